import com.eteks.sweethome3d.io.DefaultFurnitureCatalog;
import com.eteks.sweethome3d.io.DefaultTexturesCatalog;
import com.eteks.sweethome3d.j3d.AbstractPhotoRenderer;
import com.eteks.sweethome3d.j3d.PhotoRenderer;
import com.eteks.sweethome3d.model.*;
import java.awt.image.BufferedImage;
import java.io.File;
import java.nio.file.*;
import java.util.*;
import javax.imageio.ImageIO;

/** Rooms that pairs.py describes, drawn by Sweet Home 3D's own photo renderer: SweetHomeRoom LIBRARIES ROOM.txt... */
public class SweetHomeRoom {
    static final int WIDTH = 480, HEIGHT = 300;
    static final float WALL = 15;  // cm

    public static void main(String[] files) throws Exception {
        Map<String, CatalogPieceOfFurniture> models = new HashMap<>();
        File[] libraries = new File(files[0]).listFiles((folder, name) -> name.endsWith(".sh3f"));
        java.net.URL[] urls = new java.net.URL[libraries.length];
        for (int i = 0; i < urls.length; i++) urls[i] = libraries[i].toURI().toURL();
        for (FurnitureCatalog catalog : List.of(new DefaultFurnitureCatalog(), new DefaultFurnitureCatalog(urls)))
            for (FurnitureCategory category : catalog.getCategories())
                for (CatalogPieceOfFurniture piece : category.getFurniture()) {
                    models.putIfAbsent(piece.getId(), piece);
                    String model = ((com.eteks.sweethome3d.tools.URLContent) piece.getModel()).getURL().toString();
                    models.putIfAbsent(model.substring(model.indexOf("!/") + 2), piece);
                }
        Map<String, CatalogTexture> textures = new HashMap<>();
        for (TexturesCategory category : new DefaultTexturesCatalog().getCategories())
            for (CatalogTexture texture : category.getTextures()) textures.put(texture.getId(), texture);
        for (String file : Arrays.asList(files).subList(1, files.length)) {
            BufferedImage picture = drawn(Files.readAllLines(Path.of(file)), models, textures);
            ImageIO.write(picture, "png", new File(file.replace(".txt", ".png")));
            System.out.println(file);
        }
        System.exit(0);
    }

    /** Lines of words: height, floor, wall, piece, camera; centimetres and radians in the program's own frame. */
    static BufferedImage drawn(List<String> lines, Map<String, CatalogPieceOfFurniture> models,
                               Map<String, CatalogTexture> textures) throws Exception {
        Home home = new Home();
        home.getCompass().setLatitude((float) Math.toRadians(48.85));
        home.getCompass().setLongitude((float) Math.toRadians(2.35));
        home.getCompass().setTimeZone("Europe/Paris");
        List<Wall> walls = new ArrayList<>();
        Camera camera = home.getObserverCamera();
        float height = 250;
        for (String line : lines) {
            String[] words = line.split("\t");
            if (words[0].equals("height")) height = Float.parseFloat(words[1]);
            if (words[0].equals("floor")) {
                float[][] corners = new float[(words.length - 2) / 2][];
                for (int i = 0; i < corners.length; i++)
                    corners[i] = new float[] {Float.parseFloat(words[2 + 2 * i]), Float.parseFloat(words[3 + 2 * i])};
                Room room = new Room(corners);
                room.setFloorTexture(new HomeTexture(textures.get(words[1])));
                home.addRoom(room);
            }
            if (words[0].equals("wall")) {
                float[] n = numbers(words, 1);
                walls.add(new Wall(n[0], n[1], n[2], n[3], WALL, height));
            }
            if (words[0].equals("piece")) {
                CatalogPieceOfFurniture found = models.get(words[1]);
                if (found == null) throw new IllegalArgumentException(words[1]);
                HomePieceOfFurniture piece = found instanceof CatalogDoorOrWindow
                    ? new HomeDoorOrWindow((CatalogDoorOrWindow) found)
                    : found instanceof CatalogLight ? new HomeLight((CatalogLight) found) : new HomePieceOfFurniture(found);
                float[] n = numbers(words, 2);
                piece.setX(n[0]); piece.setY(n[1]); piece.setElevation(n[2]);
                piece.setWidth(n[3]); piece.setDepth(n[4]); piece.setHeight(n[5]); piece.setAngle(n[6]);
                home.addPieceOfFurniture(piece);
            }
            if (words[0].equals("camera")) {
                float[] n = numbers(words, 1);
                long noon = java.time.Instant.parse("2026-06-21T12:00:00Z").toEpochMilli();
                camera = new Camera(n[0], n[1], n[2], n[3], n[4], n[5], noon, Camera.Lens.PINHOLE);
            }
        }
        for (int i = 0; i < walls.size(); i++) {
            Wall wall = walls.get(i), next = walls.get((i + 1) % walls.size());
            wall.setWallAtEnd(next);
            next.setWallAtStart(wall);
        }
        walls.forEach(home::addWall);
        BufferedImage picture = new BufferedImage(WIDTH, HEIGHT, BufferedImage.TYPE_INT_RGB);
        PhotoRenderer renderer = new PhotoRenderer(home, AbstractPhotoRenderer.Quality.HIGH);
        renderer.render(picture, camera, null);
        renderer.dispose();
        return picture;
    }

    static float[] numbers(String[] words, int from) {
        float[] found = new float[words.length - from];
        for (int i = 0; i < found.length; i++) found[i] = Float.parseFloat(words[from + i]);
        return found;
    }
}
